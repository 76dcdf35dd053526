"""Reading, checking and editing URDF files."""
