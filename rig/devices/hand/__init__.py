"""Devices that sense a hand, the tracking filter, the process that reads them."""
