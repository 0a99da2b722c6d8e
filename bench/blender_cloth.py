# Blender's cloth on the meshes of simulation_bench, without a window:
#   blender -b --factory-startup --python bench/blender_cloth.py -- JOB.json
# The job is written by simulation_bench. Files are in metres, y up; Blender's z is up. Prints one line "TOILE {json}" with the time that the frames took.
import json
import sys
import time

import bpy


def read_obj(path):
    """Vertices (z up) and triangles of an OBJ file."""
    points, triangles = [], []
    with open(path) as lines:
        for words in map(str.split, lines):
            if words[:1] == ["v"]:
                x, y, z = map(float, words[1:4])
                points.append((x, -z, y))
            elif words[:1] == ["f"]:
                triangles.append(tuple(int(word.partition("/")[0]) - 1 for word in words[1:4]))
    return points, triangles


def add_mesh(name, points, triangles):
    data = bpy.data.meshes.new(name)
    data.from_pydata(points, [], triangles)
    data.update()
    added = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(added)
    return added


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    frames = job["frames"]
    for old in list(bpy.data.objects):
        bpy.data.objects.remove(old)
    scene = bpy.context.scene
    scene.render.fps = 30
    scene.frame_start, scene.frame_end = 1, frames + 1
    scene.gravity = (0, 0, -9.81)
    scene.frame_set(1)

    support = add_mesh("support", *read_obj(job["support"]))
    bpy.context.view_layer.objects.active = support
    support.modifiers.new("Collision", "COLLISION")
    support.collision.thickness_outer = job["outer"]
    support.collision.thickness_inner = 0.2
    support.collision.cloth_friction = job["friction"]
    support.collision.damping = 0
    support.collision.use_culling = True

    points, triangles = read_obj(job["cloth"])
    cloth = add_mesh("cloth", points, triangles)
    if job["moved"]:
        cloth.vertex_groups.new(name="held").add(job["held"] + job["moved"], 1.0, "REPLACE")
        cloth.vertex_groups.new(name="moved").add(job["moved"], 1.0, "REPLACE")
        hinge = bpy.data.objects.new("hinge", None)
        scene.collection.objects.link(hinge)
        x, y, z = job["hinge"]
        hinge.location = (x, -z, y)
        hinge.rotation_mode = "XYZ"
        bpy.context.view_layer.update()
        hook = cloth.modifiers.new("hook", "HOOK")
        hook.object = hinge
        hook.vertex_group = "moved"
        hook.matrix_inverse = hinge.matrix_world.inverted() @ cloth.matrix_world
        hook.center = hinge.location
        for frame, angle in enumerate(job["angles"]):
            hinge.rotation_euler = (0, angle, 0)
            hinge.keyframe_insert("rotation_euler", frame=1 + frame)
        for curve in hinge.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"

    modifier = cloth.modifiers.new("cloth", "CLOTH")
    settings, collisions = modifier.settings, modifier.collision_settings
    settings.quality = job["quality"]
    settings.mass = job["vertex_mass"]
    settings.bending_model = "ANGULAR"
    for kind, stiffness, damping in (("tension", 15, 5), ("compression", 15, 5), ("shear", 15, 5), ("bending", 0.5, 0.5)):
        setattr(settings, kind + "_stiffness", stiffness)
        setattr(settings, kind + "_damping", damping)
    settings.air_damping = 1
    if job["moved"]:
        settings.vertex_group_mass = "held"
        settings.pin_stiffness = 1
    collisions.use_collision = True
    collisions.collision_quality = job["collision_quality"]
    collisions.distance_min = job["distance"]
    collisions.friction = job["friction"]
    collisions.use_self_collision = True
    collisions.self_distance_min = job["self_distance"]
    collisions.self_friction = job["friction"]
    modifier.point_cache.frame_start, modifier.point_cache.frame_end = 1, frames + 1

    bpy.context.evaluated_depsgraph_get()
    start = time.perf_counter()
    for frame in range(1, frames + 2):
        scene.frame_set(frame)
    seconds = time.perf_counter() - start
    result = cloth.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    with open(job["out"], "w") as file:
        for vertex in result.vertices:
            x, y, z = vertex.co
            file.write("v %.9g %.9g %.9g\n" % (x, z, -y))
        for triangle in triangles:
            file.write("f %d %d %d\n" % tuple(corner + 1 for corner in triangle))
    print("TOILE " + json.dumps({"seconds": seconds, "version": bpy.app.version_string}), flush=True)


main()
