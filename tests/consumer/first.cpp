#include <canyon/io.hpp>
#include <iostream>

int main(int, char** arguments) {
  auto scenario = canyon::simulation::read_scenario(arguments[1]);
  auto city = canyon::simulation::load_city(scenario);
  const canyon::simulation::Simulation drive(scenario, std::move(city));
  canyon::encoding::SummarySink metrics({"car"});
  drive.run({&metrics});
  std::cout << canyon::encoding::format_summary_table(metrics.summaries());
}
