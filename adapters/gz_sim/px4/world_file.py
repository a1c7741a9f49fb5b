"""The copy of a world in which PX4's vehicles fly with Canyon's receivers: with the systems of PX4 and of Canyon."""
import os
import xml.etree.ElementTree as ElementTree

CANYON = "CanyonGnssSystem"


def prepare(source, target, systems, settings, without=()):
    """Writes the world of `source` to `target`: with the systems of PX4's server configuration that it does not have
    itself, and with Canyon's system with `settings`, elements as text. Models named in `without` are omitted.
    Returns the world's name. Raises ValueError, which names the file."""
    try:
        tree = ElementTree.parse(source)
    except (ElementTree.ParseError, OSError) as error:
        raise ValueError(f"{source}: cannot be read as a world: {error}") from None
    world = tree.getroot().find("world")
    if world is None:
        raise ValueError(f"{source}: contains no <world>; give a world such as 'canyon city build map.osm -o city.sdf' writes")
    if world.find("spherical_coordinates") is None:
        raise ValueError(f"{source}: has no <spherical_coordinates>, so its position on the Earth is unknown")
    for model in world.findall("model"):
        if model.get("name") in without:
            world.remove(model)
    for plugin in world.findall("plugin"):
        if CANYON in plugin.get("filename", ""):
            world.remove(plugin)
    named = {plugin.get("filename") for plugin in world.findall("plugin")}
    for plugin in systems_of(systems):
        if plugin.get("filename") not in named:
            world.append(plugin)
    canyon = ElementTree.fromstring(f'<plugin filename="{CANYON}" name="canyon::GnssSystem">{settings}</plugin>')
    world.append(canyon)
    absolute_uris(world, os.path.dirname(os.path.abspath(source)))
    tree.write(target, xml_declaration=True, encoding="utf-8")
    return world.get("name", "default")


def systems_of(path):
    """The plugins of a server configuration, as elements of a world."""
    try:
        plugins = ElementTree.parse(path).getroot().iter("plugin")
    except (ElementTree.ParseError, OSError) as error:
        raise ValueError(f"{path}: cannot be read as a server configuration: {error}") from None
    result = []
    for plugin in plugins:
        plugin.attrib.pop("entity_name", None)
        plugin.attrib.pop("entity_type", None)
        result.append(plugin)
    return result


def absolute_uris(world, folder):
    """The copy is in another folder than the files named in its world."""
    for uri in world.iter("uri"):
        path = os.path.join(folder, (uri.text or "").strip())
        if uri.text and "://" not in uri.text and os.path.exists(path):
            uri.text = path
