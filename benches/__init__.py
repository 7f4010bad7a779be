"""Methods compared with each other and with the truth; `raters`: what two of them simulate."""
