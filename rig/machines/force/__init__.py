"""Force devices: the wall and its states in C, servo, watchdog, back ends, a stand-in."""
