"""What a process of Riposte is: its loop, its files, its log and its end."""
