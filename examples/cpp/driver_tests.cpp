// Tests of a driver in C++: ./driver_tests NAME, exit code 0 if it passes. CMakeLists.txt gives them to CTest.

#include "client.hpp"

#include <cmath>
#include <functional>
#include <map>

static void expect(bool holds, const std::string& what) {
    if (!holds) throw std::runtime_error("expected " + what);
}

// The robot reaches its target, faster than in real time.
static void goes_there() {
    Simulator simulator({"--clock", "fast"});
    Robot robot(simulator.host(), simulator.port());
    robot.command("lin move", {450, 200, 520, 0, -1.57079, 0, 0.1, 0});
    robot.wait_until_stopped(std::chrono::seconds(50));
    expect(std::abs(robot.numbers("get tool frame", 6)[1] - 200) < 1e-3, "the TCP at y = 200 mm");
}

// An emergency stop reaches the driver as an error.
static void emergency_stop() {
    Simulator simulator({"--clock", "fast"});
    Robot robot(simulator.host(), simulator.port());
    Backdoor backdoor(simulator.host(), simulator.backdoor_port());
    backdoor.call("emergency_stop");
    expect(robot.ask("lin move : 450 200 520 0 -1.57079 0 0.1 0") == "error", "an error");
    expect(robot.ask("get error").compare(0, 4, "3030") == 0, "code 3030");
}

// The driver notices a lost reply.
static void lost_reply() {
    Simulator simulator;
    Robot robot(simulator.host(), simulator.port(), 1);
    Backdoor backdoor(simulator.host(), simulator.backdoor_port());
    backdoor.call("set_fault", R"({"fault": {"type": "Drop"}, "replies": 1})");
    try {
        robot.ask("hello");
    } catch (const std::runtime_error&) {
        return;
    }
    expect(false, "no reply");
}

int main(int count, char** arguments) {
    const std::map<std::string, std::function<void()>> tests = {
        {"goes_there", goes_there}, {"emergency_stop", emergency_stop}, {"lost_reply", lost_reply}};
    if (count != 2 || tests.count(arguments[1]) == 0) {
        std::cerr << "usage: driver_tests NAME" << std::endl;
        return 2;
    }
    try {
        tests.at(arguments[1])();
    } catch (const std::exception& fault) {
        std::cerr << arguments[1] << ": " << fault.what() << std::endl;
        return 1;
    }
}
