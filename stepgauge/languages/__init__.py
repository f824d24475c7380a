"""What pages, messages and printed reports say in the languages that are spoken here."""
