"""What a host says to a device: definition, envelope, transports, and the link that uses them.

docs/device.md#the-wire
"""
