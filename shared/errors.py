"""The errors Riposte raises on purpose.

::

    RiposteError                what a command prints as one line before it exits with 2
    ├── ConfigError             a site file, a flag or a value out of range
    ├── MessageError            bytes from the bus that are not the message they claim to be
    ├── SnapshotError           a policy artifact that is damaged or does not fit here
    ├── CheckpointError         a saved state that is damaged or belongs to another run
    ├── LedgerError             the league's ledger is damaged or belongs to another run
    ├── SimulationError         the physics produced something that is not a number
    ├── BusError                no session, no answer, or a refused request
    │   └── StaleInput          an input older than its deadline
    ├── RobotFault              the robot, or what guards it, refuses
    ├── IdentificationError     a data set or a fit that cannot be used
    └── StudyError              a study's folder that is damaged, or that does not allow it

``ValueError`` stays the word for a caller's bug.
"""


class RiposteError(Exception):
    """Base of every error that a user can cause and mend; its text is one readable line."""


class ConfigError(RiposteError):
    """A site file, a flag or a value that is unknown or out of range."""


class MessageError(RiposteError, ValueError):
    """Bytes that are not the message they claim to be; nothing of them has been used."""


class SnapshotError(RiposteError):
    """A policy artifact that is damaged, or that does not fit this build; names the field."""


class CheckpointError(RiposteError):
    """A saved state that is damaged or belongs to another run."""


class LedgerError(RiposteError):
    """The league's ledger is damaged or belongs to another run."""


class SimulationError(RiposteError):
    """The physics produced a value that is not finite."""


class BusError(RiposteError):
    """The bus has no session, got no answer in time, or a request was refused."""


class StaleInput(BusError):
    """An input is older than its deadline."""


class RobotFault(RiposteError):
    """The robot, or the gate that guards it, refuses to go on."""


class IdentificationError(RiposteError):
    """A data set or a fit that cannot be used."""


class StudyError(RiposteError):
    """A study's folder that is damaged, or in which what is asked for cannot be done."""
