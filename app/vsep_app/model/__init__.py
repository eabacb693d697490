"""Settings, URL and pictures: what is shown, without any widget."""
