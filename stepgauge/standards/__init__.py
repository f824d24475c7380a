"""What a standard makes of the same recordings: length measurement by ISO 10360-2, positioning by ISO 230-2."""
