"""What host and machine say: registers from one file, frames, ports and sockets, the link's thread.

docs/device.md#the-wire
"""
