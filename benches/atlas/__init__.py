"""Where methods fail, a case each."""
