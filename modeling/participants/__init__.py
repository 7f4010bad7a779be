"""How a participant comes to a rating or a choice: for simulation, planning and verdicts alike."""
