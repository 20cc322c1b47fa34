*** Settings ***
Library           IiwaSim.py    clock=fast
Test Setup        Restore Robot

*** Test Cases ***
The Robot Goes Where It Is Sent
    Lin Move    450    200    520    0    -1.57079    0    speed=0.1
    Wait Until Stopped
    Tool Should Be At    450    200    520

A Move Out Of Reach Is Refused With A Reason
    Run Keyword And Expect Error    refused: 3021 *    Lin Move    2000    0    520    0    -1.57079    0

An Emergency Stop Is An Error
    Press Emergency Stop
    Error Code Should Be    3030
    Run Keyword And Expect Error    refused: 3030 *    Joint Move    0.5    0    0.5    0    -1.2    0    1.4    0
