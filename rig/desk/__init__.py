"""`DeskRig`: hand, sound and accelerometer as one rig, its journal; `twin`s in virtual time;
`inventory`: what is connected.
"""
