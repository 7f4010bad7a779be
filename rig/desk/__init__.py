"""The desk rig: a card that plays, a hand that is read, and what a session asks of them."""
