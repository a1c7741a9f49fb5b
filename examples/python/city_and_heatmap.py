"""A city of OpenStreetMap, inspected by its triangles, and a map of its satellites and errors."""

import pathlib
import sys
import tempfile

import numpy as np

import canyon

OSM = """<osm version="0.6">
 <node id="1" lat="48.13700" lon="11.57500"/><node id="2" lat="48.13700" lon="11.57560"/>
 <node id="3" lat="48.13735" lon="11.57560"/><node id="4" lat="48.13735" lon="11.57500"/>
 <node id="5" lat="48.13700" lon="11.57580"/><node id="6" lat="48.13700" lon="11.57640"/>
 <node id="7" lat="48.13735" lon="11.57640"/><node id="8" lat="48.13735" lon="11.57580"/>
 <way id="1"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="4"/><nd ref="1"/>
  <tag k="building" v="yes"/><tag k="height" v="22"/></way>
 <way id="2"><nd ref="5"/><nd ref="6"/><nd ref="7"/><nd ref="8"/><nd ref="5"/>
  <tag k="building" v="yes"/><tag k="building:levels" v="9"/></way>
</osm>"""

with tempfile.TemporaryDirectory() as folder:
    # Any extract works: canyon.City.from_osm("district.osm.pbf")
    source = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(folder, "two_houses.osm")
    if len(sys.argv) < 2:
        source.write_text(OSM)
    city = canyon.City.from_osm(str(source))
    print(city, "about", np.round(city.origin, 5))
    for thing in city.objects[:3]:
        print(f"  {thing.surface:9} {thing.name}: {thing.triangle_count} triangles")

    # The triangles are the engine's own memory: areas of the walls by material.
    corners = city.vertices[city.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1) / 2
    walls = np.abs(normals[:, 2]) < 0.1 * 2 * areas
    for material in np.unique(city.materials[walls]):
        print(f"  walls of {canyon.MATERIALS[material]}: {areas[walls & (city.materials == material)].sum():.0f} m2")

    latitude, longitude, height = city.origin
    scenario = canyon.Scenario(city={"osm": [str(source)]}, start="2026-06-01T08:00:00Z",
                               receivers=[{"name": "phone", "profile": "ideal"}])
    chart = canyon.heatmap(scenario, city, spacing_m=2, altitudes_m=[1.5, 30],
                           layers=["satellites_los", "horizontal_error", "hdop"])
    print(f"{chart.cells_computed} cells")
    free = chart.state == canyon.CELL_STATES.index("computed")
    for index, altitude in enumerate(chart.altitudes_m):
        in_sight = chart["satellites_los"][0, index][free[index]]
        error = chart["horizontal_error"][0, index][free[index]]
        print(f"  {altitude:4.1f} m: {np.mean(in_sight):.1f} satellites in sight, worst place {in_sight.min():.0f}; "
              f"error without noise: largest {np.nanmax(error):.1f} m, no fix on {np.isnan(error).mean():.1%}")
    chart.write(f"{folder}/map.nc")
    chart.write(f"{folder}/pictures")
    print("written:", sorted(p.name for p in pathlib.Path(folder, "pictures").glob("*.png")), "and map.nc")
