// Time of Pinocchio's regressor and inverse dynamics, one thread, per sample.
//
// Reads from standard input the models that time_pinocchio.py writes (joint types, placements,
// inertia), so that everything timed is compiled here with the options chosen here, and none of it
// comes from a shared library built for an older processor.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include <pinocchio/multibody.hpp>
#include <pinocchio/multibody/joint.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>

namespace pin = pinocchio;
typedef pin::ModelTpl<double> Model;
typedef pin::DataTpl<double> Data;

static Model::JointModel joint(const std::string & name, const Eigen::Vector3d & axis)
{
  if (name == "JointModelRX") return pin::JointModelRX();
  if (name == "JointModelRY") return pin::JointModelRY();
  if (name == "JointModelRZ") return pin::JointModelRZ();
  if (name == "JointModelPX") return pin::JointModelPX();
  if (name == "JointModelPY") return pin::JointModelPY();
  if (name == "JointModelPZ") return pin::JointModelPZ();
  if (name == "JointModelRevoluteUnaligned") return pin::JointModelRevoluteUnaligned(axis);
  if (name == "JointModelPrismaticUnaligned") return pin::JointModelPrismaticUnaligned(axis);
  throw std::runtime_error("joint of type " + name + " is not timed here");
}

static Model read(std::istream & in, int joints)
{
  Model model;
  for (int i = 0; i < joints; ++i)
  {
    std::size_t parent;
    std::string type;
    Eigen::Vector3d axis, position, com;
    Eigen::Matrix3d rotation, tensor;
    double mass;
    in >> parent >> type;
    for (int k = 0; k < 3; ++k) in >> axis[k];
    for (int k = 0; k < 9; ++k) in >> rotation(k / 3, k % 3);
    for (int k = 0; k < 3; ++k) in >> position[k];
    in >> mass;
    for (int k = 0; k < 3; ++k) in >> com[k];
    for (int k = 0; k < 9; ++k) in >> tensor(k / 3, k % 3);
    const auto id = model.addJoint(
      parent, joint(type, axis), pin::SE3(rotation, position), "joint" + std::to_string(i));
    model.appendBodyToJoint(id, pin::Inertia(mass, com, tensor), pin::SE3::Identity());
  }
  return model;
}

// Minimum and median over `repeats` of the mean time of one call, in microseconds.
template<typename F>
static void time(const std::string & label, std::size_t samples, int repeats, F && f)
{
  std::vector<double> times;
  for (int k = 0; k < repeats; ++k)
  {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < samples; ++i) f(i);
    const std::chrono::duration<double, std::micro> d = std::chrono::steady_clock::now() - start;
    times.push_back(d.count() / double(samples));
  }
  std::sort(times.begin(), times.end());
  std::printf("%-34s %8.3f %8.3f\n", label.c_str(), times.front(), times[times.size() / 2]);
}

int main(int argc, char ** argv)
{
  const int repeats = argc > 1 ? std::stoi(argv[1]) : 2000;
  const std::size_t samples = 1000;
  std::printf("%-34s %8s %8s   us per sample\n", "", "min", "median");
  std::string name;
  int joints;
  while (std::cin >> name >> joints)
  {
    const Model model = read(std::cin, joints);
    Data data(model);
    std::vector<Eigen::VectorXd> q, v, a;
    for (std::size_t i = 0; i < samples; ++i)
    {
      q.push_back(Eigen::VectorXd::Random(model.nq));
      v.push_back(Eigen::VectorXd::Random(model.nv));
      a.push_back(Eigen::VectorXd::Random(model.nv));
    }
    double sum = 0.0;
    time(name + " computeJointTorqueRegressor", samples, repeats, [&](std::size_t i) {
      sum += pin::computeJointTorqueRegressor(model, data, q[i], v[i], a[i])(0, 5);
    });
    time(name + " rnea", samples, repeats, [&](std::size_t i) {
      sum += pin::rnea(model, data, q[i], v[i], a[i])[0];
    });
    std::fprintf(stderr, "%s: checksum %.17g\n", name.c_str(), sum);
  }
}
