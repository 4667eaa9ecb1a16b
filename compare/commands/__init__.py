"""The commands, one a module: a function that has the command's name. `compare.commands.app` lists them."""
