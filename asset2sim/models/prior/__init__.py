"""The offline model: household sizes, materials and mechanisms from tables, and the words of the guidance."""
