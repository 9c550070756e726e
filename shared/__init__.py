"""The library of Riposte: functions and values, imported by the processes in ``services``."""
