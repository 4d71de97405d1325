"""What is proved of a box of poses."""

from __future__ import annotations

from sagline.core.status import Status
from sagline.kernels.workspaces.pose_box_proof import INSIDE, OPEN, OUTSIDE


class ProofVerdict(Status):
    """What is proved of a box of poses, or of a part of one."""

    OPEN = OPEN, "neither is proved of all of the box: see the shares; a longer budget decides more"
    PROVED_INSIDE = INSIDE, "at every pose every load is balanced by tensions within the limits"
    PROVED_OUTSIDE = OUTSIDE, "at no position is every load balanced by tensions within the limits"
