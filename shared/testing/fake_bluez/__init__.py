"""A BlueZ with one adapter and one heart-rate strap, on a private message bus, for tests.

The real bleak talks to it as it would to the real one: the process under test only needs
``DBUS_SYSTEM_BUS_ADDRESS`` set to ``FakeBluez.address``. Needs ``dbus-daemon`` and dbus_fast,
which bleak brings along on Linux.
"""
