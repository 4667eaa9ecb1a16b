"""Commands that compare solvers on one finger."""
