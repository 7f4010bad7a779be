"""The demonstration for visitors: textures under the hand, and which layers are felt, live."""
