// A driver of the iiwa's line protocol: POSIX sockets and nothing else.
//
//     c++ -std=c++17 -O2 examples/client.cpp -o client
//     ./client 127.0.0.1 30000
//
// It says where the robot is, moves the TCP 50 mm to the side on a straight line, polls until the robot has
// stopped, and moves back. Exit code 0 if all went well, 1 with a line on stderr if not. The connection is in
// client.hpp, the only file that your project needs.

#include "client.hpp"

static void print(const char* title, const std::vector<double>& values) {
    std::cout << title;
    for (const double value : values) std::cout << ' ' << value;
    std::cout << std::endl;
}

int main(int count, char** arguments) {
    if (count != 3) {
        std::cerr << "usage: client HOST PORT" << std::endl;
        return 1;
    }
    try {
        Robot robot(arguments[1], arguments[2]);
        print("joints", robot.numbers("get joint position", 7));

        // x y z in mm, alpha beta gamma in rad (intrinsic Z-Y-X), of the TCP in the robot's base
        const std::vector<double> start = robot.numbers("get tool frame", 6);
        print("start", start);

        std::vector<double> target = start;
        target[1] += 50;
        const double speed = 0.5, blending_mm = 0;
        target.insert(target.end(), {speed, blending_mm});
        robot.command("lin move", target);
        robot.wait_until_stopped(std::chrono::seconds(30));
        print("there", robot.numbers("get tool frame", 6));

        std::vector<double> back = start;
        back.insert(back.end(), {speed, blending_mm});
        robot.command("ptp move", back);
        robot.wait_until_stopped(std::chrono::seconds(30));
        print("back", robot.numbers("get tool frame", 6));
        robot.ask("bye");
    } catch (const std::exception& fault) {
        std::cerr << fault.what() << std::endl;
        return 1;
    }
}
