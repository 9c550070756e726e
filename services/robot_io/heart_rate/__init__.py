"""The heart rate of the person: a strap over Bluetooth, or a recording."""
