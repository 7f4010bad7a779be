"""The one filter of fitting and rendering: coefficients, response, level; `PEQ`; sign patterns."""
