"""python -m tactileq."""

from tactileq.app import main

main()
