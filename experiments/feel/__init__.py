"""What one shows a visitor: textures under the hand, and what of them is felt, live."""
