"""What breaks in users' hands: hostile inputs, made here, and what becomes of each."""
