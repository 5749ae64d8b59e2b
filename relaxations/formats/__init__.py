"""Problems from and to files and other notations; one format, one file."""
