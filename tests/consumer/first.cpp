#include <canyon/io.hpp>
#include <iostream>

int main(int, char** arguments) {
  const auto scenario = canyon::simulation::read_scenario(arguments[1]);
  const canyon::simulation::Simulation drive(scenario, canyon::simulation::load_city(scenario.city));
  canyon::output::SummarySink figures({"car"});
  drive.run({&figures});
  std::cout << canyon::output::format_summary_table(figures.summaries());
}
