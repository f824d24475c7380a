"""Reading and writing: text, TOML, tables, values with units; outputs that are written whole; templates."""
