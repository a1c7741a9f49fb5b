// A tool reads a city from a file. Links canyon::io.
#include <canyon/io.hpp>
#include <cstdio>

int main(int argc, char** argv) {
  try {
    const canyon::city::City city = canyon::city::read_mesh_city(argc > 1 ? argv[1] : "absent.obj", {});
    std::printf("%zu triangles\n", city.mesh.triangles.size());
    return city.mesh.triangles.size() == 2 ? 0 : 1;
  } catch (const canyon::InputError& error) {
    std::printf("%s\n", error.what());
    return 2;
  }
}
