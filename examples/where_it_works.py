"""Workspace of a robot with different loads.

The hull is exact at its corners, and the slice is exact at its points. Any
program for meshes can open the mesh.
"""

import sagline as sl

robot = sl.load_robot("cogiro")
volumes = {}
for force in (0.0, 100.0, 200.0, 400.0):
    loads = sl.WrenchBox(force=force, moment=0.1 * force)
    space = sl.workspace(robot, wrenches=loads, cells=16)
    volumes[force] = space.volume
    error = space.volume_error
    print(f"±{force:3.0f} N: {space.volume:5.1f} ± {error:.1f} m3")
    if force == 100.0:
        sl.plot.save(sl.plot.workspace(space), "where_it_works_hull.png")
        slice = sl.plot.slice(space, "z", at=2.0)
        sl.plot.save(slice, "where_it_works_slice.png")
        space.surface.export("hull.glb")
