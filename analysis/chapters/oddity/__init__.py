"""D′ of the odd one out."""
