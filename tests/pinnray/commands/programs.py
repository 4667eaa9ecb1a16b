"""Python programs that tests start in processes of their own."""

COMMAND = "import sys; from pinnray.cli import main; sys.exit(main(sys.argv[1:]))"

WITHOUT_PICTURES = f"import compare.pipeline.pipeline as p; p.draw_all = lambda *_, **__: []; {COMMAND}"
"""Pictures take most of the time of a small comparison, and have tests of their own."""
