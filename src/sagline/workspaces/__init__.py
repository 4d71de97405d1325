"""Where a robot can work: loads, margins, the boundary, and proofs of it."""
