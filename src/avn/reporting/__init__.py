"""Tables, figures, films and report pages of results."""
