"""ALConnectionManager over the wire: a cable, and a radio that finds nothing."""


def test_the_cable_is_pulled_and_plugged_in_again(naoqi, wait_until):
    manager, states = naoqi.ALConnectionManager, []
    subscriber = naoqi.ALMemory.subscriber("NetworkStateChanged")
    subscriber.signal.connect(states.append)
    (service,) = (dict(pairs) for pairs in manager.services())
    assert (service["Type"], service["State"], manager.state()) == ("ethernet", "online", "online")
    manager.disconnect(service["ServiceId"])
    assert manager.state() == "offline" and dict(manager.service(service["ServiceId"]))["State"] == "idle"
    manager.connect(service["ServiceId"])
    wait_until(lambda: states == ["offline", "online"], "both were reported")


def test_settings_are_read_as_they_were_written(naoqi, refused):
    manager = naoqi.ALConnectionManager
    identity = dict(manager.services()[0])["ServiceId"]
    manager.setServiceIPv4(identity, {"Method": "manual", "Address": "192.168.1.5", "Netmask": "255.255.255.0"})
    manager.setServiceNameservers(identity, ["192.168.1.1"])
    described = dict(manager.service(identity))
    assert dict(described["IPv4"])["Address"] == "192.168.1.5" and described["Nameservers"] == ["192.168.1.1"]
    assert "no IPv4 address" in refused(manager.setServiceIPv4, identity, {"Address": "here"})
    manager.forget(identity)
    assert dict(dict(manager.service(identity))["IPv4"])["Method"] == "dhcp"
    manager.connect(identity)
    manager.enableTethering("wifi", "Salt", "12345678")
    assert manager.getTetheringEnable("wifi") and manager.tetheringName("wifi") == "Salt"
    manager.disableTethering("wifi")
    manager.provisionService({"Type": "wifi", "Name": "Lab", "Passphrase": "secret12"})
    assert manager.provisionedServices() == [{"Type": "wifi", "Name": "Lab"}], "a passphrase is not told"
    manager.removeProvisionedService("Lab")
