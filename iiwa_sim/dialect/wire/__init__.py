"""What dialects share: lines, tables, numbers, what is said and what becomes of replies on their way."""
