"""The desk rig: a sound card that plays, a hand that is read, and a session's interface to them."""
