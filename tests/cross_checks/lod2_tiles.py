#!/usr/bin/env python3
"""Writes synthetic LoD 2 houses as 1 km tiles in the format of Germany's surveying offices.

    lod2_tiles.py DIR TILES HOUSES_OF_A_TILE

For measurements: canyon city build DIR -o city.canyon. The same arguments give the same files.
"""
import math
import os
import random
import sys

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<core:CityModel xmlns:core="http://www.opengis.net/citygml/1.0" xmlns:bldg="http://www.opengis.net/citygml/building/1.0" \
xmlns:gen="http://www.opengis.net/citygml/generics/1.0" xmlns:gml="http://www.opengis.net/gml" \
xmlns:xAL="urn:oasis:names:tc:ciq:xsdschema:xAL:2.0" xmlns:xlink="http://www.w3.org/1999/xlink">
<gml:boundedBy><gml:Envelope srsDimension="3" srsName="urn:adv:crs:ETRS89_UTM33*DE_DHHN2016_NH">\
<gml:lowerCorner>{e:.3f} {n:.3f} 30</gml:lowerCorner><gml:upperCorner>{e1:.3f} {n1:.3f} 80</gml:upperCorner>\
</gml:Envelope></gml:boundedBy>
"""
ATTRIBUTES = ("DatenquelleDachhoehe", "DatenquelleLage", "DatenquelleBodenhoehe", "Gemeindeschluessel", "BezugspunktDach")
FUNCTIONS = ("1010", "1000", "2000", "2020", "2463")


def positions(points):
    return " ".join("%.3f %.3f %.3f" % p for p in points)


def polygon(name, points):
    return (f'<gml:surfaceMember><gml:Polygon gml:id="{name}"><gml:exterior><gml:LinearRing gml:id="{name}_0_"><gml:posList>'
            f"{positions(points + points[:1])}</gml:posList></gml:LinearRing></gml:exterior></gml:Polygon></gml:surfaceMember>")


def house(number, x, y, step):
    """A house with a gable roof, its corner at (x, y)."""
    width, depth = step * random.uniform(.4, .8), step * random.uniform(.4, .8)
    low, eaves = random.uniform(34, 36), random.uniform(4, 20)
    ridge = eaves + random.uniform(2, 5)
    corners = [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]
    a, b, c, d = ((*p, low) for p in corners)
    e, f, g, h = ((*p, low + eaves) for p in corners)
    m, n = (x, y + depth / 2, low + ridge), (x + width, y + depth / 2, low + ridge)
    faces = [("GroundSurface", [a, d, c, b]), ("WallSurface", [a, b, f, e]), ("WallSurface", [b, c, g, n, f]),
             ("WallSurface", [c, d, h, g]), ("WallSurface", [d, a, e, m, h]), ("RoofSurface", [e, f, n, m]),
             ("RoofSurface", [g, h, m, n])]
    name = f"DEBE3D{number:010d}"
    attributes = "".join(f'<gen:stringAttribute name="{k}"><gen:value>1000</gen:value></gen:stringAttribute>' for k in ATTRIBUTES)
    shell = "".join(f'<gml:surfaceMember xlink:href="#{name}_p{i}"/>' for i in range(len(faces)))
    surfaces = "".join(
        f'<bldg:boundedBy><bldg:{kind} gml:id="{name}_s{i}"><core:creationDate>2020-01-01</core:creationDate>'
        f"<bldg:lod2MultiSurface><gml:MultiSurface>{polygon(f'{name}_p{i}', points)}</gml:MultiSurface>"
        f"</bldg:lod2MultiSurface></bldg:{kind}></bldg:boundedBy>\n" for i, (kind, points) in enumerate(faces))
    return (f'<core:cityObjectMember><bldg:Building gml:id="{name}"><core:creationDate>2020-01-01</core:creationDate>{attributes}'
            f"<bldg:function>31001_{random.choice(FUNCTIONS)}</bldg:function><bldg:roofType>3100</bldg:roofType>"
            f'<bldg:measuredHeight uom="urn:adv:uom:m">{ridge:.3f}</bldg:measuredHeight>'
            f"<bldg:lod2Solid><gml:Solid><gml:exterior><gml:CompositeSurface>{shell}</gml:CompositeSurface></gml:exterior>"
            f"</gml:Solid></bldg:lod2Solid><bldg:lod2TerrainIntersection><gml:MultiCurve><gml:curveMember><gml:LineString>"
            f"<gml:posList>{positions([a, b, c, d, a])}</gml:posList></gml:LineString></gml:curveMember></gml:MultiCurve>"
            f"</bldg:lod2TerrainIntersection>{surfaces}<bldg:address><core:Address><core:xalAddress><xAL:AddressDetails>"
            f"<xAL:Country><xAL:CountryName>Germany</xAL:CountryName></xAL:Country></xAL:AddressDetails></core:xalAddress>"
            f"</core:Address></bldg:address></bldg:Building></core:cityObjectMember>\n")


def main(folder, tiles, houses):
    os.makedirs(folder, exist_ok=True)
    random.seed(7)
    side, columns = math.ceil(math.sqrt(tiles)), math.ceil(math.sqrt(houses))
    step = 1000 / columns
    for tile in range(tiles):
        e, n = 380000 + 1000 * (tile % side), 5810000 + 1000 * (tile // side)
        with open(f"{folder}/LoD2_33_{e // 1000}_{n // 1000}_1_BE.gml", "w") as out:
            out.write(HEAD.format(e=e, n=n, e1=e + 1000, n1=n + 1000))
            for k in range(houses):
                out.write(house(tile * houses + k + 1, e + step * (k % columns) + 2, n + step * (k // columns) + 2, step))
            out.write("</core:CityModel>\n")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
