"""What readings say of a robot, pose by pose; docs/model.md, section 14."""
