"""The embedded arm in smid and in other libraries."""
