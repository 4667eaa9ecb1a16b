"""The commands: a module has the name of one, whose function is `command`; `app` here lists them."""
