"""Commands about models, scenes, stimuli and exports."""
