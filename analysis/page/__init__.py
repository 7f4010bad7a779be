"""Parts of every page: tables, pictures, sections, provenance, how figures are drawn and saved."""
