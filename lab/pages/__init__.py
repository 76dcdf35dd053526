"""Parts of the documentation made from a catalog: tables, example questions (an SQL file each) and a picture."""
