"""The kinds of hostile cases, a module each with a function ``cases``; a new module is found by its being here."""
