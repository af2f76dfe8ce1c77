"""From a timeline of actions to one long motion."""
