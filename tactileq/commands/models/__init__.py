"""Commands about models, scenes, stimuli, vibrators and exports."""
