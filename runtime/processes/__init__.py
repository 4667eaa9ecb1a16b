"""Child processes: `pool` runs tasks in them, `child` is their side, `worker` limits time and memory."""
