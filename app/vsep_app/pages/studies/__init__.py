"""Page of Monte-Carlo studies."""
