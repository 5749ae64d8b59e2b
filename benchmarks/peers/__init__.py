"""Other identification tools on the measured records, on the test part that smid is tested on."""
