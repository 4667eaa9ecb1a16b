"""The commands, one a module: a function that has the command's name. `pinnray.commands.app` lists them."""
