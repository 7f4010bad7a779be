"""Subject sessions, from plan to stored answer."""
