"""Commands about a study and its sessions."""
