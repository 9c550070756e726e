"""The bus: topics and acknowledged requests between processes, over Zenoh or in memory."""
