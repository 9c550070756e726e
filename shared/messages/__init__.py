"""Everything that crosses the bus: messages, their wire format and the topic table."""
