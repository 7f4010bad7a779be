"""Force devices: the servo of a virtual wall, its watchdog, and back ends."""
