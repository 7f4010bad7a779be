"""The chapters of the report; `chapter` is what they are given."""
